"""What Ellinger and Zaeh print: tables 2 to 5, and deviations named in the text.

Source: J. Ellinger, M. F. Zaeh, Machines 10 (2022) 535.
"""

from types import MappingProxyType

from fitting.identification.conformity import Statistics

TABLES = MappingProxyType(
    {
        ("ideal", "identification"): MappingProxyType(
            {
                "frac": Statistics(84.93, 86.21, 94.92, 96.12),
                "csf": Statistics(91.72, 92.78, 97.17, 98.04),
                "macxp": Statistics(99.86, 99.88, 99.97, 100.00),
                "ndd": Statistics(4.10, 1.99, 0.52, 0.27),
            }
        ),
        ("ideal", "validation"): MappingProxyType(
            {
                "frac": Statistics(79.17, 79.41, 90.21, 91.63),
                "csf": Statistics(88.43, 88.78, 94.19, 95.58),
                "macxp": Statistics(99.86, 99.89, 99.98, 100.00),
                "ndd": Statistics(5.48, 4.73, 1.07, 0.24),
            }
        ),
        ("disturbed", "identification"): MappingProxyType(
            {
                "frac": Statistics(92.15, 96.70, 99.26, 99.85),
                "csf": Statistics(95.73, 97.15, 99.49, 99.91),
                "macxp": Statistics(99.92, 99.96, 99.99, 100.00),
                "ndd": Statistics(1.69, 1.51, 0.40, 0.25),
            }
        ),
        ("disturbed", "validation"): MappingProxyType(
            {
                "frac": Statistics(97.53, 98.41, 99.60, 99.83),
                "csf": Statistics(97.36, 98.36, 99.64, 99.91),
                "macxp": Statistics(88.57, 89.78, 98.65, 99.99),
                "ndd": Statistics(40.65, 39.83, 6.05, 0.43),
            }
        ),
    }
)
"""Tables 2 to 5 [%], by case and positions."""
DEVIATIONS = MappingProxyType(
    {
        "ideal": MappingProxyType({"ME1 k_z": -21.2, "ME2 k_z": -8.3, "CPL d_rz": 200.0, "ME2 b_x": -67.7}),
        "disturbed": MappingProxyType({"ME1 k_x": 12.1}),
    }
)
"""Deviations of identified parameters that the text names [%]; sections 3.2 and 3.3. The others' are only drawn."""
SECONDS = MappingProxyType({"sensitivity": 64 * 60.0, "parts": 68 * 60.0})
"""Time that the paper's study took, on 40 cores [s]; section 3.2."""
