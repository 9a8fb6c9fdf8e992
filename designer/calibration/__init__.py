"""From images of a flat target at unknown poses to the sensor as it was built: the parameters, and how well known."""
