// Part of the interface of hardware_interface, for a test without ROS 2. The state interfaces come from the URDF, as in
// Jazzy and later.
// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef HARDWARE_INTERFACE__SENSOR_INTERFACE_HPP_
#define HARDWARE_INTERFACE__SENSOR_INTERFACE_HPP_

#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "hardware_interface/hardware_info.hpp"
#include "hardware_interface/types/hardware_interface_return_values.hpp"
#include "rclcpp/duration.hpp"
#include "rclcpp/logging.hpp"
#include "rclcpp/time.hpp"
#include "rclcpp_lifecycle/node_interfaces/lifecycle_node_interface.hpp"

namespace hardware_interface
{

using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;

class SensorInterface : public rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface
{
public:
  virtual CallbackReturn on_init(const HardwareInfo & info)
  {
    for (const auto & sensor : info.sensors) {
      for (const auto & interface : sensor.state_interfaces) {
        states_[sensor.name + "/" + interface.name] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    return CallbackReturn::SUCCESS;
  }

  virtual return_type read(const rclcpp::Time & time, const rclcpp::Duration & period) = 0;

  void set_state(const std::string & name, const double & value) {state(name) = value;}
  double get_state(const std::string & name) const {return states_.at(name);}
  rclcpp::Logger get_logger() const {return {};}

private:
  double & state(const std::string & name)
  {
    const auto found = states_.find(name);
    if (found == states_.end()) {
      throw std::runtime_error("no state interface " + name);
    }
    return found->second;
  }

  std::map<std::string, double> states_;
};

}  // namespace hardware_interface

#endif  // HARDWARE_INTERFACE__SENSOR_INTERFACE_HPP_
