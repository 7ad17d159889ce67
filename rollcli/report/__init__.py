"""A result as one HTML page."""

import logging

# where its folders cannot be written it says so on stderr, as soon as it is imported
logging.getLogger("matplotlib").setLevel(logging.ERROR)
