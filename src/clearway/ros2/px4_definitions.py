"""Messages of PX4's external modes, by their fields, for PX4 1.16 to 1.18.

PX4 names a message alike in every release and puts its version into the topic's name. Here a
version whose fields differ has its own name, `VehicleStatusV4`; `bus.wire_kind` drops the end.
"""

from __future__ import annotations

_REGISTER = """
uint64 timestamp
uint64 request_id
char[25] name
uint16 px4_ros2_api_version
bool register_arming_check
bool register_mode
bool register_mode_executor
bool enable_replace_internal_mode
uint8 replace_internal_mode
bool activate_mode_immediately
"""
_REGISTERED = """
uint64 timestamp
uint64 request_id
char[25] name
uint16 px4_ros2_api_version
bool success
int8 arming_check_id
int8 mode_id
int8 mode_executor_id
"""
_UNREGISTER = """
uint64 timestamp
char[25] name
int8 arming_check_id
int8 mode_id
int8 mode_executor_id
"""
_ARMING_REQUEST = """
uint64 timestamp
uint8 request_id
"""
_EVENT = """
uint64 timestamp
uint32 id
uint16 event_sequence
uint8[25] arguments
uint8 log_levels
"""
_ARMING_REPLY = """
uint64 timestamp
uint8 request_id
uint8 registration_id
uint8 health_component_index
bool health_component_is_present
bool health_component_warning
bool health_component_error
bool can_arm_and_run
uint8 num_events
px4_msgs/Event[5] events
bool mode_req_angular_velocity
bool mode_req_attitude
bool mode_req_local_alt
bool mode_req_local_position
bool mode_req_local_position_relaxed
bool mode_req_global_position
{relaxed}bool mode_req_mission
bool mode_req_home_position
bool mode_req_prevent_arming
bool mode_req_manual_control
"""
_STATUS = """
uint64 timestamp
uint64 armed_time
uint64 takeoff_time
uint8 arming_state
uint8 latest_arming_reason
uint8 latest_disarming_reason
uint64 nav_state_timestamp
uint8 nav_state_user_intention
uint8 nav_state
uint8 executor_in_charge
{display}uint32 valid_nav_states_mask
uint32 can_set_nav_states_mask
{failures}uint8 hil_state
uint8 vehicle_type
bool failsafe
bool failsafe_and_user_took_over
uint8 failsafe_defer_state
bool gcs_connection_lost
uint8 gcs_connection_lost_counter
bool high_latency_data_link_lost
bool is_vtol
bool is_vtol_tailsitter
bool in_transition_mode
bool in_transition_to_fw
uint8 system_type
uint8 system_id
uint8 component_id
bool safety_button_available
bool safety_off
bool power_input_valid
bool usb_connected
bool open_drone_id_system_present
bool open_drone_id_system_healthy
bool parachute_system_present
bool parachute_system_healthy
{traffic}bool rc_calibration_in_progress
bool calibration_enabled
bool pre_flight_checks_pass
"""
_LOCAL_POSITION = """
uint64 timestamp
uint64 timestamp_sample
bool xy_valid
bool z_valid
bool v_xy_valid
bool v_z_valid
float32 x
float32 y
float32 z
float32[2] delta_xy
uint8 xy_reset_counter
float32 delta_z
uint8 z_reset_counter
float32 vx
float32 vy
float32 vz
float32 z_deriv
float32[2] delta_vxy
uint8 vxy_reset_counter
float32 delta_vz
uint8 vz_reset_counter
float32 ax
float32 ay
float32 az
float32 heading
float32 heading_var
float32 unaided_heading
float32 delta_heading
uint8 heading_reset_counter
bool heading_good_for_control
float32 tilt_var
bool xy_global
bool z_global
uint64 ref_timestamp
float64 ref_lat
float64 ref_lon
float32 ref_alt
bool dist_bottom_valid
float32 dist_bottom
float32 dist_bottom_var
float32 delta_dist_bottom
uint8 dist_bottom_reset_counter
uint8 dist_bottom_sensor_bitfield
float32 eph
float32 epv
float32 evh
float32 evv
bool dead_reckoning
float32 vxy_max
float32 vz_max
float32 hagl_min
float32 hagl_max_z
float32 hagl_max_xy
"""
_ODOMETRY = """
uint64 timestamp
uint64 timestamp_sample
uint8 pose_frame
float32[3] position
float32[4] q
uint8 velocity_frame
float32[3] velocity
float32[3] angular_velocity
float32[3] position_variance
float32[3] orientation_variance
float32[3] velocity_variance
uint8 reset_counter
int8 quality
"""
_COMMAND = """
uint64 timestamp
float32 param1
float32 param2
float32 param3
float32 param4
float64 param5
float64 param6
float32 param7
uint32 command
uint8 target_system
uint8 target_component
uint8 source_system
uint16 source_component
uint8 confirmation
bool from_external
"""
_CONTROL_MODE = """
uint64 timestamp
bool flag_armed
bool flag_multicopter_position_control_enabled
bool flag_control_manual_enabled
bool flag_control_auto_enabled
bool flag_control_offboard_enabled
bool flag_control_position_enabled
bool flag_control_velocity_enabled
bool flag_control_altitude_enabled
bool flag_control_climb_rate_enabled
bool flag_control_acceleration_enabled
bool flag_control_attitude_enabled
bool flag_control_rates_enabled
bool flag_control_allocation_enabled
bool flag_control_termination_enabled
uint8 source_id
"""
_LAND_DETECTED = """
uint64 timestamp
bool freefall
bool ground_contact
bool maybe_landed
bool landed
bool in_ground_effect
bool in_descend
bool has_low_throttle
bool vertical_movement
bool horizontal_movement
bool rotational_movement
bool close_to_ground_or_skipped_check
bool at_rest
"""
_HOME = """
uint64 timestamp
float64 lat
float64 lon
float32 alt
float32 x
float32 y
float32 z
{tilt}float32 yaw
bool valid_alt
bool valid_hpos
bool valid_lpos
bool manual_home
uint32 update_count
"""
_OBSTACLE_DISTANCE = """
uint64 timestamp
uint8 frame
uint8 sensor_type
uint16[72] distances
float32 increment
uint16 min_distance
uint16 max_distance
float32 angle_offset
"""
_DISPLAY = "uint8 nav_state_display\nbool accepts_offboard_setpoints\n"
_SELECTABLE = "bool not_user_selectable\n"
_OFFBOARD = "bool request_offboard_setpoints\n"

PX4_DEFINITIONS = {
    f"px4_msgs/msg/{name}": text
    for name, text in {
        "Event": _EVENT,
        "RegisterExtComponentRequest": _REGISTER,
        "RegisterExtComponentRequestV2": _REGISTER + _SELECTABLE + _OFFBOARD,
        "RegisterExtComponentReply": _REGISTERED,
        "RegisterExtComponentReplyV1": _REGISTERED + _SELECTABLE,
        "UnregisterExtComponent": _UNREGISTER,
        "ArmingCheckRequest": _ARMING_REQUEST,
        "ArmingCheckRequestV1": _ARMING_REQUEST + "uint32 valid_registrations_mask\n",
        "ArmingCheckReply": _ARMING_REPLY.format(relaxed=""),
        "ArmingCheckReplyV1": _ARMING_REPLY.format(
            relaxed="bool mode_req_global_position_relaxed\n"
        ),
        "ModeCompleted": "uint64 timestamp\nuint8 result\nuint8 nav_state\n",
        "VehicleStatusV1": _STATUS.format(
            display="", failures="uint16 failure_detector_status\n", traffic=""
        ),
        "VehicleStatusV4": _STATUS.format(
            display=_DISPLAY, failures="", traffic="bool traffic_avoidance_system_present\n"
        ),
        "VehicleLocalPosition": _LOCAL_POSITION,
        "VehicleOdometry": _ODOMETRY,
        "VehicleCommand": _COMMAND,
        "VehicleControlMode": _CONTROL_MODE,
        "VehicleLandDetected": _LAND_DETECTED,
        "HomePosition": _HOME.format(tilt=""),
        "HomePositionV1": _HOME.format(tilt="float32 roll\nfloat32 pitch\n"),
        "ObstacleDistance": _OBSTACLE_DISTANCE,
        "SetpointConfig": "uint64 timestamp\nuint16 type\nuint8 source_id\n"
        "bool should_apply\nuint16 timeout_ms\n",
        "SetpointConfigReply": "uint64 timestamp\nuint16 type\nuint8 source_id\nuint8 result\n"
        "bool mode_req_angular_velocity\nbool mode_req_attitude\n"
        "bool mode_req_local_alt\nbool mode_req_local_position\n",
        "MessageFormatRequest": "uint64 timestamp\nuint16 protocol_version\nchar[50] topic_name\n",
        "MessageFormatResponse": "uint64 timestamp\nuint16 protocol_version\nchar[50] topic_name\n"
        "bool success\nuint32 message_hash\n",
    }.items()
}
