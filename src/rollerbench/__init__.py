"""A Drake workbench for wheeled, omnidirectional and wheel-legged mobile robots.

Parts are imported when they are first used: describing a robot and its kinematics does not load Drake.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
