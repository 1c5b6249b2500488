"""The processor farm: which chunk goes to which worker, and what happens when one is lost."""
