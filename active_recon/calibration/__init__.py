"""
Calibration: where a camera stands around the object, from images of a ChArUco board.

Poses and pixels here are OpenCV's: the board's frame has its origin in the board's outer corner,
x along a row of squares, y along a column, z into the paper; a pixel's centre is a whole number.
What leaves is in the object frame and in REP-103, as everywhere else.
"""
