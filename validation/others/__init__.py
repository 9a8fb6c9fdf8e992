"""How numbers of other programs were found: each module prints them and writes nothing; none imports the designer."""
