"""What figures are measured on."""

import os
import platform
from typing import Any


def machine() -> dict[str, Any]:
    """Return cores, load over the last minute and processor of this machine."""
    return {
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "cpu": platform.processor() or platform.machine(),
    }
