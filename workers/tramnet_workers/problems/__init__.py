"""What can be asked of a robot: fitness of whole chunks of chromosomes, and plans made from them."""
