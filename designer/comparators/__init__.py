"""What else could be built for a requirement: other ideas of panoramic stereo, designed, traced and scored alike.

One module for each idea, one table of them (:mod:`designer.comparators.table`). An idea need not have single
viewpoints: depth errors come from traced rays alone (:mod:`designer.comparators.errors`).
"""
