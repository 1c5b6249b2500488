"""A worker node: its state machine, its evaluator and the process around them."""
