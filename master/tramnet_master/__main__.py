"""``python -m tramnet_master`` is ``tramnet``."""

from tramnet_master.cli import main

if __name__ == "__main__":
    main()
