"""Validation: the shipped studies beside what papers print: all of Wang et al. (2014), the mechanics of bulens2023."""

from .comparison import PAPERS as PAPERS
from .comparison import Comparison as Comparison
from .comparison import compare as compare
from .comparison import comparison_mapping as comparison_mapping
from .comparison import comparison_markdown as comparison_markdown
from .comparison import validate as validate
from .evidence import STUDIES as STUDIES
from .evidence import Work as Work
from .rows import Row as Row
from .rows import Stored as Stored
from .rows import allowed_geometry as allowed_geometry
from .rows import geometry_table as geometry_table
from .rows import rows_mapping as rows_mapping
from .rows import rows_markdown as rows_markdown
from .rows import rows_table as rows_table
from .sensor import detection_rows as detection_rows
from .sensor import pouring_rows as pouring_rows
