"""Starts the command, on one core."""

if __name__ == "__main__":
    from .machine import use_one_core

    # Before numpy is imported.
    use_one_core()

    from .cli import main

    main()
