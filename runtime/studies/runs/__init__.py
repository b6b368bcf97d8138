"""One run, several, a run in pieces, and what is looked at beside a run."""
