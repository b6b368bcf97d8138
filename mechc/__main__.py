"""``python -m mechc`` is the command ``mechc``."""

from .cli import main

if __name__ == "__main__":
    main()
