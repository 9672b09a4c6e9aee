from .page import report_page as report_page
from .stored_run import StoredRun as StoredRun
