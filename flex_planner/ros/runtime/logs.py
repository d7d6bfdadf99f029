"""Python's logging, as the core uses it, shown by ROS."""

from __future__ import annotations

import logging

from flex_planner.base.text import printable
import rclpy.logging

_LONGEST = 20000


class _RosHandler(logging.Handler):
    """Passes records to the logger of the same name in ROS."""

    def emit(self, record: logging.LogRecord) -> None:
        """Log one record."""
        logger = rclpy.logging.get_logger(record.name)
        text = printable(self.format(record), _LONGEST, keep='\n\t')
        # rclpy allows one severity per calling line
        if record.levelno >= logging.ERROR:
            logger.error(text)
        elif record.levelno >= logging.WARNING:
            logger.warning(text)
        else:
            logger.info(text)


def forward_logs(logger: logging.Logger) -> None:
    """Show a Python logger's records as ROS log messages."""
    logger.addHandler(_RosHandler())
    logger.setLevel(logging.INFO)
    logger.propagate = False
