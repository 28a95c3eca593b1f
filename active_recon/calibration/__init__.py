"""
Calibration: the pose of a camera relative to the object, from images of a ChArUco board.

The board's frame is OpenCV's: its origin is the board's outer corner, x along a row of squares, y
along a column, z into the paper. Other frames are those of `active_recon.geometry.cameras`.
"""
