"""The actions of the grammar: what a rule has read becomes a node of the syntax tree."""
