"""From syntax to programs: flat model, mechanical system, equations, program, targets."""
