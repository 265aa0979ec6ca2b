"""How numbers, symbols and channels are written, in sentences, tables and figures alike."""
