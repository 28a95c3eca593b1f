"""Which nodes can share a process, for those who start them and have no ROS themselves."""

COMPOSABLE = {'reconstructor': 'ReconstructorNode', 'view_planner': 'ViewPlannerNode',
              'turntable_camera': 'TurntableCameraNode'}
"""
The class of each node that may share a process with others.

The recorder, the player and the viewer may not: they would wait for the network, or it for them.
"""
