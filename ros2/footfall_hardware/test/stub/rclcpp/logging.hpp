// Part of the interface of rclcpp, for a test without ROS 2.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef RCLCPP__LOGGING_HPP_
#define RCLCPP__LOGGING_HPP_

#include <cstdio>

namespace rclcpp
{

class Logger
{
};

/// Prints a line to standard error, with the compiler's check of its format.
[[gnu::format(printf, 2, 3)]] inline void log(const Logger &, const char * format, ...)
{
  __builtin_va_list arguments;
  __builtin_va_start(arguments, format);
  std::vfprintf(stderr, format, arguments);
  __builtin_va_end(arguments);
  std::fputc('\n', stderr);
}

}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) ::rclcpp::log(logger, __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) ::rclcpp::log(logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) ::rclcpp::log(logger, __VA_ARGS__)

#endif  // RCLCPP__LOGGING_HPP_
