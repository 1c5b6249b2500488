from hypothesis import settings

# Kernels compile at their first call, which no deadline survives.
settings.register_profile("tramnet", deadline=None, max_examples=60, print_blob=True)
settings.load_profile("tramnet")
