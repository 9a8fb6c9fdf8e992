"""The report's figures, one idea each. Every function returns a matplotlib figure of a given size in millimetres."""
