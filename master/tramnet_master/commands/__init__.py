"""The commands of ``tramnet``, one module a group."""
