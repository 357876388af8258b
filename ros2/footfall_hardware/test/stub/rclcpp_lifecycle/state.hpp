// Part of the interface of rclcpp_lifecycle, for a test without ROS 2.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef RCLCPP_LIFECYCLE__STATE_HPP_
#define RCLCPP_LIFECYCLE__STATE_HPP_

namespace rclcpp_lifecycle
{

class State
{
};

}  // namespace rclcpp_lifecycle

#endif  // RCLCPP_LIFECYCLE__STATE_HPP_
