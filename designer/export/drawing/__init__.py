"""Drawing sheets (``.pdf``): one for each mirror, one for the assembly. Paper is measured in mm, x right and y down."""
