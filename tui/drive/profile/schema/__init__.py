"""Form of a profile file: plain data, checked strictly while it is decoded.

Every struct is one table of the TOML file. Raw values are words as on the wire. Scales are decimal
strings, so that values are never rounded by a float. Each module has one subject; other packages
import from here. Annotations are not texts here: it takes time to evaluate some hundred of them.
"""

from .base import *
from .channel import *
from .chart import *
from .evidence import *
from .fault_help import *
from .identification import *
from .link import *
from .monitoring import *
from .parameter import *
from .search import *
from .signal_path import *
from .whole import *
from .wiring import *
