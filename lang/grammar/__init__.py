"""Text to tokens and tables: the lexer, the words of the language, the grammar (``mech.lark``) and the parser's tables."""
