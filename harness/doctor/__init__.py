"""The doctor: is this installation whole, does it fly right, and does it move the bits of a flight?"""

from harness.doctor.examination import examine
from harness.doctor.finding import Finding, Soundness

__all__ = ["Finding", "Soundness", "examine"]
