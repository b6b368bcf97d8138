"""What exists under which name: files, classes, instances, and the scopes in which names are looked up."""
