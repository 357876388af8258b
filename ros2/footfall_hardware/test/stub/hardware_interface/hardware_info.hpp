// Part of the interface of hardware_interface, for a test without ROS 2.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef HARDWARE_INTERFACE__HARDWARE_INFO_HPP_
#define HARDWARE_INTERFACE__HARDWARE_INFO_HPP_

#include <string>
#include <unordered_map>
#include <vector>

namespace hardware_interface
{

struct InterfaceInfo
{
  std::string name;
};

struct ComponentInfo
{
  std::string name;
  std::string type;
  std::vector<InterfaceInfo> state_interfaces;
  std::unordered_map<std::string, std::string> parameters;
};

struct HardwareInfo
{
  std::string name;
  std::string type;
  std::unordered_map<std::string, std::string> hardware_parameters;
  std::vector<ComponentInfo> sensors;
};

}  // namespace hardware_interface

#endif  // HARDWARE_INTERFACE__HARDWARE_INFO_HPP_
