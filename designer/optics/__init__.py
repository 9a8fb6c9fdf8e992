"""What light should do: conics with single viewpoints, the views they give, and the layout of a whole system.

Every formula runs on floats, NumPy arrays and CasADi symbols alike (see ``backend``).
"""
