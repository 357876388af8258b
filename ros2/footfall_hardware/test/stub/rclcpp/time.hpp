// Part of the interface of rclcpp, for a test without ROS 2.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef RCLCPP__TIME_HPP_
#define RCLCPP__TIME_HPP_

#include <cstdint>

namespace rclcpp
{

class Time
{
public:
  explicit Time(int64_t nanoseconds = 0)
  : nanoseconds_(nanoseconds) {}
  double seconds() const {return static_cast<double>(nanoseconds_) * 1e-9;}

private:
  int64_t nanoseconds_;
};

}  // namespace rclcpp

#endif  // RCLCPP__TIME_HPP_
