// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef FOOTFALL_HARDWARE__FOOTFALL_SENSOR_HPP_
#define FOOTFALL_HARDWARE__FOOTFALL_SENSOR_HPP_

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "footfall.h"
#include "footfall_hardware/foot.hpp"
#include "footfall_hardware/lines.hpp"
#include "hardware_interface/hardware_info.hpp"
#include "hardware_interface/sensor_interface.hpp"
#include "hardware_interface/types/hardware_interface_return_values.hpp"
#include "rclcpp/duration.hpp"
#include "rclcpp/time.hpp"
#include "rclcpp_lifecycle/state.hpp"

namespace footfall_hardware
{

/// Exports footfall's feet as sensors of ros2_control. Each `<sensor>` of the URDF is a foot, on a CAN bus or on its own
/// serial port. No call waits for a line: `read` takes the bytes received so far.
class FootfallSensor : public hardware_interface::SensorInterface
{
public:
  hardware_interface::CallbackReturn on_init(const hardware_interface::HardwareInfo & info) override;
  hardware_interface::CallbackReturn on_configure(const rclcpp_lifecycle::State & previous) override;
  hardware_interface::CallbackReturn on_activate(const rclcpp_lifecycle::State & previous) override;
  hardware_interface::CallbackReturn on_cleanup(const rclcpp_lifecycle::State & previous) override;

  hardware_interface::return_type read(
    const rclcpp::Time & time, const rclcpp::Duration & period) override;

protected:
  /// Passes a CAN frame to its foot. Frames of other nodes, and frames that no foot sends, are ignored.
  void take(const CanFrame & frame, double now_s);

private:
  struct Sensor
  {
    std::string name;
    /// Serial port; empty for a foot on the bus.
    std::string port;
    Foot foot;
    SerialPort serial;
    footfall_stream stream;
    /// Time of the newest attempt to open the port, s.
    double opened_at_s;
    bool has_warned;
    /// State interfaces of the URDF: full name, and the value.
    std::vector<std::pair<std::string, double FootValues::*>> interfaces;
  };

  bool add(const hardware_interface::ComponentInfo & component);
  void read_bus(double now_s);
  void read_serial(Sensor & sensor, double now_s);
  void publish(const Sensor & sensor, const FootValues & values);

  std::string can_interface_;
  unsigned baud_ = 0;
  double silent_after_s_ = 0.0;
  VelocityParameters velocity_;
  CanBus bus_;
  /// Nodes of the feet on the bus.
  std::vector<uint8_t> nodes_;
  /// Time of the newest attempt to open a bus that was lost, s.
  double bus_opened_at_s_ = -INFINITY;
  std::vector<Sensor> sensors_;
  std::vector<uint8_t> bytes_;
};

}  // namespace footfall_hardware

#endif  // FOOTFALL_HARDWARE__FOOTFALL_SENSOR_HPP_
