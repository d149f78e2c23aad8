"""Tell: what a task calls to say something to its bench meanwhile."""

from collections.abc import Callable
from typing import Any

Tell = Callable[[Any], None]
