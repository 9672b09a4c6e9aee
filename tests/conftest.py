import sys
from pathlib import Path

# Helpers shared by the tests (robots.py) are found whichever way rollerbench is installed.
sys.path.insert(0, str(Path(__file__).parent))
