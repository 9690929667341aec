"""Rod linkages: rods with scissor joints, deployed, loaded and designed."""
