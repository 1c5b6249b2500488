from processes import start

__all__ = ["start"]
