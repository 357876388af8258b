// SPDX-License-Identifier: MIT OR Apache-2.0

#include "footfall_hardware/footfall_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <unordered_map>

#include "pluginlib/class_list_macros.hpp"
#include "rclcpp/logging.hpp"

namespace footfall_hardware
{
namespace
{

using hardware_interface::CallbackReturn;
using hardware_interface::return_type;
using Parameters = std::unordered_map<std::string, std::string>;

struct Interface
{
  std::string_view name;
  double FootValues::* value;
};

constexpr Interface INTERFACES[] = {
  {"contact", &FootValues::contact},
  {"p_stable", &FootValues::p_stable},
  {"sigma_v", &FootValues::sigma_v},
  {"slip", &FootValues::slip},
};

struct NamedNode
{
  std::string_view name;
  uint8_t node;
};

/// Node ids of feet without another id.
constexpr NamedNode NODES[] = {
  {"FL", 0x11}, {"FR", 0x12}, {"RL", 0x13}, {"RR", 0x14}, {"L", 0x15}, {"R", 0x16},
};

/// Period of attempts to open a line that has gone, s.
constexpr double OPEN_AGAIN_S = 1.0;

/// Frames or pieces that one read takes at most, so that a flood does not delay the control loop.
constexpr int MOST_READS = 256;

std::string text_of(const Parameters & parameters, const std::string & name)
{
  const auto found = parameters.find(name);
  return found == parameters.end() ? "" : found->second;
}

/// Number of a parameter, in [least, most].
double number_of(
  const Parameters & parameters, const std::string & name, double otherwise, double least,
  double most)
{
  const std::string text = text_of(parameters, name);
  if (text.empty()) {
    return otherwise;
  }
  std::istringstream stream(text);
  // The point is the separator of decimals, whatever the locale of the controller manager is.
  stream.imbue(std::locale::classic());
  double number = NAN;
  stream >> std::noskipws >> number;
  const bool is_whole = !stream.fail() && stream.peek() == std::istringstream::traits_type::eof();
  if (!is_whole || !(number >= least && number <= most)) {
    throw std::invalid_argument(
            name + " is " + text + ", and not a number from " + std::to_string(least) + " to " +
            std::to_string(most));
  }
  return number;
}

/// Returns whether the next attempt to open a line is due. If the clock was set back, it is due at once.
bool is_due(double newest_attempt_s, double now_s)
{
  return now_s < newest_attempt_s || now_s - newest_attempt_s >= OPEN_AGAIN_S;
}

uint8_t node_of_name(const std::string & name)
{
  const auto found = std::find_if(
    std::begin(NODES), std::end(NODES), [&name](const NamedNode & one) {return one.name == name;});
  return found == std::end(NODES) ? 0 : found->node;
}

}  // namespace

CallbackReturn FootfallSensor::on_init(const hardware_interface::HardwareInfo & info)
{
  if (SensorInterface::on_init(info) != CallbackReturn::SUCCESS) {
    return CallbackReturn::ERROR;
  }
  try {
    const auto & parameters = info.hardware_parameters;
    can_interface_ = text_of(parameters, "can_interface");
    baud_ = static_cast<unsigned>(number_of(parameters, "baud", 1e6, 1.0, 1e7));
    silent_after_s_ = number_of(parameters, "silent_after", 0.05, 0.001, 10.0);
    velocity_.speed = number_of(parameters, "velocity.speed", velocity_.speed, 0.001, 10.0);
    velocity_.lever = number_of(parameters, "velocity.lever", velocity_.lever, 0.0, 10.0);
    velocity_.floor = number_of(parameters, "velocity.floor", velocity_.floor, 0.0001, 1.0);
    sensors_.clear();
    for (const auto & component : info.sensors) {
      if (!add(component)) {
        return CallbackReturn::ERROR;
      }
    }
  } catch (const std::invalid_argument & error) {
    RCLCPP_ERROR(get_logger(), "%s", error.what());
    return CallbackReturn::ERROR;
  }
  if (sensors_.empty()) {
    RCLCPP_ERROR(get_logger(), "no <sensor>: each foot is one");
    return CallbackReturn::ERROR;
  }
  return CallbackReturn::SUCCESS;
}

bool FootfallSensor::add(const hardware_interface::ComponentInfo & component)
{
  const std::string & name = component.name;
  const std::string port = text_of(component.parameters, "port");
  const double number = number_of(component.parameters, "node", node_of_name(name), 0.0, 127.0);
  const auto node = static_cast<uint8_t>(number);
  if (node != number) {
    RCLCPP_ERROR(get_logger(), "%s has the node %f, which is not an integer", name.c_str(), number);
    return false;
  }
  if (port.empty() && (node == 0 || can_interface_.empty())) {
    RCLCPP_ERROR(
      get_logger(), "%s has no port: give the sensor a port, or can_interface and the sensor a node",
      name.c_str());
    return false;
  }
  for (const Sensor & other : sensors_) {
    const bool is_same = port.empty() ? other.port.empty() && other.foot.node() == node :
      other.port == port;
    if (is_same) {
      RCLCPP_ERROR(get_logger(), "%s and %s are one foot", other.name.c_str(), name.c_str());
      return false;
    }
  }
  Sensor sensor{name, port, Foot(node, velocity_, silent_after_s_), {}, {}, -INFINITY, false, {}};
  for (const auto & interface : component.state_interfaces) {
    const auto found = std::find_if(
      std::begin(INTERFACES), std::end(INTERFACES),
      [&interface](const Interface & one) {return one.name == interface.name;});
    if (found == std::end(INTERFACES)) {
      RCLCPP_ERROR(
        get_logger(), "%s has no state %s, only contact, p_stable, sigma_v and slip", name.c_str(),
        interface.name.c_str());
      return false;
    }
    sensor.interfaces.emplace_back(name + "/" + interface.name, found->value);
  }
  sensors_.push_back(std::move(sensor));
  return true;
}

CallbackReturn FootfallSensor::on_configure(const rclcpp_lifecycle::State &)
{
  nodes_.clear();
  for (Sensor & sensor : sensors_) {
    if (sensor.port.empty()) {
      nodes_.push_back(sensor.foot.node());
      continue;
    }
    const std::string error = sensor.serial.open(sensor.port, baud_);
    if (!error.empty()) {
      RCLCPP_ERROR(get_logger(), "%s: %s", sensor.name.c_str(), error.c_str());
      return CallbackReturn::FAILURE;
    }
  }
  if (!nodes_.empty()) {
    const std::string error = bus_.open(can_interface_, nodes_);
    if (!error.empty()) {
      RCLCPP_ERROR(get_logger(), "%s", error.c_str());
      return CallbackReturn::FAILURE;
    }
  }
  return CallbackReturn::SUCCESS;
}

CallbackReturn FootfallSensor::on_activate(const rclcpp_lifecycle::State &)
{
  for (Sensor & sensor : sensors_) {
    sensor.foot = Foot(sensor.foot.node(), velocity_, silent_after_s_);
    sensor.has_warned = false;
    footfall_stream_init(&sensor.stream);
    publish(sensor, sensor.foot.values(0.0));
  }
  return CallbackReturn::SUCCESS;
}

CallbackReturn FootfallSensor::on_cleanup(const rclcpp_lifecycle::State &)
{
  bus_.close();
  for (Sensor & sensor : sensors_) {
    sensor.serial.close();
  }
  return CallbackReturn::SUCCESS;
}

return_type FootfallSensor::read(const rclcpp::Time & time, const rclcpp::Duration &)
{
  const double now_s = time.seconds();
  read_bus(now_s);
  for (Sensor & sensor : sensors_) {
    if (!sensor.port.empty()) {
      read_serial(sensor, now_s);
    }
    if (sensor.foot.wrong_node() != 0 && !sensor.has_warned) {
      sensor.has_warned = true;
      RCLCPP_ERROR(
        get_logger(), "%s is node %d, and the board on %s is node %d: its values are unknown",
        sensor.name.c_str(), sensor.foot.node(), sensor.port.c_str(), sensor.foot.wrong_node());
    }
    publish(sensor, sensor.foot.values(now_s));
  }
  return return_type::OK;
}

void FootfallSensor::read_bus(double now_s)
{
  if (!bus_.is_open() && !nodes_.empty() && is_due(bus_opened_at_s_, now_s)) {
    bus_opened_at_s_ = now_s;
    if (bus_.open(can_interface_, nodes_).empty()) {
      RCLCPP_INFO(get_logger(), "%s is back", can_interface_.c_str());
    }
  }
  CanFrame frame;
  for (int count = 0; bus_.is_open() && count < MOST_READS; ++count) {
    switch (bus_.next(frame)) {
      case Received::DATA:
        take(frame, now_s);
        break;
      case Received::NOTHING:
        return;
      case Received::LOST:
        // All its feet fall silent.
        RCLCPP_ERROR(get_logger(), "%s is lost", can_interface_.c_str());
        bus_.close();
        bus_opened_at_s_ = now_s;
        return;
    }
  }
}

void FootfallSensor::take(const CanFrame & frame, double now_s)
{
  footfall_frame decoded;
  if (footfall_decode(frame.id, frame.data, frame.length, &decoded) != FOOTFALL_OK) {
    return;
  }
  for (Sensor & sensor : sensors_) {
    if (sensor.port.empty() && sensor.foot.node() == decoded.node) {
      sensor.foot.take(decoded, now_s);
    }
  }
}

void FootfallSensor::read_serial(Sensor & sensor, double now_s)
{
  if (!sensor.serial.is_open()) {
    if (!is_due(sensor.opened_at_s, now_s)) {
      return;
    }
    sensor.opened_at_s = now_s;
    if (!sensor.serial.open(sensor.port, baud_).empty()) {
      return;
    }
    footfall_stream_init(&sensor.stream);
    RCLCPP_INFO(get_logger(), "%s is back on %s", sensor.name.c_str(), sensor.port.c_str());
  }
  for (int count = 0; count < MOST_READS; ++count) {
    const Received received = sensor.serial.next(bytes_);
    if (received == Received::LOST) {
      RCLCPP_WARN(get_logger(), "%s: %s is lost", sensor.name.c_str(), sensor.port.c_str());
      sensor.serial.close();
      sensor.opened_at_s = now_s;
      return;
    }
    for (const uint8_t byte : bytes_) {
      footfall_message message;
      if (footfall_stream_push(&sensor.stream, byte, &message) == FOOTFALL_OK) {
        sensor.foot.take(message, now_s);
      }
    }
    if (received == Received::NOTHING) {
      return;
    }
  }
}

void FootfallSensor::publish(const Sensor & sensor, const FootValues & values)
{
  for (const auto & [name, value] : sensor.interfaces) {
    set_state(name, values.*value);
  }
}

}  // namespace footfall_hardware

PLUGINLIB_EXPORT_CLASS(footfall_hardware::FootfallSensor, hardware_interface::SensorInterface)
