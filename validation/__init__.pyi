from .discrepancy.compare import Discrepancy as Discrepancy, compare as compare
