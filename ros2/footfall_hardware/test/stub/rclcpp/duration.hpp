// Part of the interface of rclcpp, for a test without ROS 2.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef RCLCPP__DURATION_HPP_
#define RCLCPP__DURATION_HPP_

#include <cstdint>

namespace rclcpp
{

class Duration
{
public:
  Duration(int32_t seconds, uint32_t nanoseconds)
  : nanoseconds_(int64_t{seconds} * 1000000000 + nanoseconds) {}
  double seconds() const {return static_cast<double>(nanoseconds_) * 1e-9;}

private:
  int64_t nanoseconds_;
};

}  // namespace rclcpp

#endif  // RCLCPP__DURATION_HPP_
