"""FMUs as users meet them: written with their documents, accounted for, and run."""
