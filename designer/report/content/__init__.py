"""What the report says: its sections, tables and sentences."""
