// Part of the interface of pluginlib, for a test without ROS 2: checks that the class is of the base.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef PLUGINLIB__CLASS_LIST_MACROS_HPP_
#define PLUGINLIB__CLASS_LIST_MACROS_HPP_

#include <type_traits>

#define PLUGINLIB_EXPORT_CLASS(derived, base) \
  static_assert(std::is_base_of_v<base, derived> && std::is_default_constructible_v<derived>);

#endif  // PLUGINLIB__CLASS_LIST_MACROS_HPP_
