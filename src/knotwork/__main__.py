"""Run the command line as `python -m knotwork`."""

from knotwork.cli.main import main

if __name__ == "__main__":
    main()
