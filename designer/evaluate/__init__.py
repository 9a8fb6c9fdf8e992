"""What a design is worth: depth resolution, its closed-form limit, angular resolution, and the mirrors' shapes."""
