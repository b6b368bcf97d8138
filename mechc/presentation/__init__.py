"""What people see: messages, reports, tables and pictures."""
