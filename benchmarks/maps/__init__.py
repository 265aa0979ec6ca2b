"""What a Peterka map costs, and whether it is right."""
