// Feeds bytes to the component as a robot does, and prints what it exports: a line for each read.
//
// Standard input has one command per line. All numbers except times are hexadecimal.
//
//     serial FL 00ab12     bytes that come on the pseudo-terminal of FL
//     can 191 0011223344   a frame of the bus
//     unplug FL            the pseudo-terminal goes
//     read 0.5             a read at this time, s
//
// SPDX-License-Identifier: MIT OR Apache-2.0

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "footfall_hardware/footfall_sensor.hpp"
#include "footfall_hardware/lines.hpp"

namespace
{

using footfall_hardware::CanFrame;
using footfall_hardware::File;
using hardware_interface::CallbackReturn;

const std::vector<std::string> INTERFACES = {"contact", "p_stable", "sigma_v", "slip"};

/// The component, with frames of a bus that this machine need not have.
class Fed : public footfall_hardware::FootfallSensor
{
public:
  using FootfallSensor::take;
};

/// Checks what must hold.
void require(bool holds, const std::string & what)
{
  if (!holds) {
    throw std::runtime_error(what);
  }
}

/// A pseudo-terminal. Bytes written to it can be read from its port.
struct Terminal
{
  File file;
  std::string port;
};

Terminal terminal()
{
  File file(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  require(
    file.is_open() && ::grantpt(file.descriptor()) == 0 && ::unlockpt(file.descriptor()) == 0,
    "a pseudo-terminal");
  std::string port = ::ptsname(file.descriptor());
  return {std::move(file), port};
}

hardware_interface::ComponentInfo sensor(const std::string & name)
{
  hardware_interface::ComponentInfo sensor;
  sensor.name = name;
  for (const auto & interface : INTERFACES) {
    sensor.state_interfaces.push_back({interface});
  }
  return sensor;
}

std::vector<uint8_t> bytes_of(const std::string & digits)
{
  std::vector<uint8_t> bytes;
  for (size_t at = 0; at + 1 < digits.size(); at += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoul(digits.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

/// Checks that errors of the description are refused.
void check_refusals()
{
  const auto is_refused = [](const hardware_interface::HardwareInfo & info) {
      return Fed().on_init(info) == CallbackReturn::ERROR;
    };
  hardware_interface::HardwareInfo info;
  require(is_refused(info), "no sensor is refused");
  info.sensors = {sensor("FL")};
  require(is_refused(info), "a foot without a line is refused");
  info.hardware_parameters["can_interface"] = "can0";
  require(!is_refused(info), "a foot of the bus is known by its name");
  info.sensors.push_back(sensor("front"));
  require(is_refused(info), "a foot of another name without a node is refused");
  info.sensors.back().parameters["node"] = "17";
  require(is_refused(info), "two feet of one node are refused");
  info.sensors.back().parameters["node"] = "18.5";
  require(is_refused(info), "a node with decimals is refused");
  info.sensors.back().parameters["node"] = "18";
  require(!is_refused(info), "a foot of another node is taken");
  info.sensors.back().state_interfaces.push_back({"force"});
  require(is_refused(info), "another state is refused");
  info.sensors.pop_back();
  info.hardware_parameters["silent_after"] = "soon";
  require(is_refused(info), "a text in place of a number is refused");
  info.hardware_parameters["silent_after"] = "0.05s";
  require(is_refused(info), "a number with a unit is refused");
}

void run()
{
  check_refusals();
  // FL and FR have serial ports, RL and RR are on the bus.
  std::map<std::string, Terminal> terminals;
  hardware_interface::HardwareInfo info;
  info.hardware_parameters["can_interface"] = "can0";
  for (const std::string name : {"FL", "FR", "RL", "RR"}) {
    info.sensors.push_back(sensor(name));
    if (name[0] == 'F') {
      terminals[name] = terminal();
      info.sensors.back().parameters["port"] = terminals[name].port;
    }
  }
  Fed fed;
  require(fed.on_init(info) == CallbackReturn::SUCCESS, "the description is taken");
  // Opens both ports. On a machine without this bus the component logs that.
  fed.on_configure({});
  require(fed.on_activate({}) == CallbackReturn::SUCCESS, "it starts");

  double now_s = 0.0;
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string command, of, digits;
    words >> command >> of >> digits;
    if (command == "serial") {
      const auto bytes = bytes_of(digits);
      const auto count = ::write(terminals.at(of).file.descriptor(), bytes.data(), bytes.size());
      require(count == static_cast<ssize_t>(bytes.size()), "all bytes are written");
    } else if (command == "can") {
      const auto bytes = bytes_of(digits);
      CanFrame frame{static_cast<uint32_t>(std::stoul(of, nullptr, 16)), {}, bytes.size()};
      std::copy_n(bytes.begin(), std::min<size_t>(bytes.size(), 8), frame.data);
      fed.take(frame, now_s);
    } else if (command == "unplug") {
      terminals.at(of).file.reset();
    } else if (command == "read") {
      now_s = std::stod(of);
      const rclcpp::Time time(static_cast<int64_t>(now_s * 1e9));
      require(
        fed.read(time, rclcpp::Duration(0, 1000000)) == hardware_interface::return_type::OK, "a read");
      std::string separator;
      for (const auto & sensor : info.sensors) {
        for (const auto & interface : INTERFACES) {
          std::cout << separator << fed.get_state(sensor.name + "/" + interface);
          separator = " ";
        }
      }
      std::cout << std::endl;
    } else {
      throw std::runtime_error("no command: " + line);
    }
  }
  require(fed.on_cleanup({}) == CallbackReturn::SUCCESS, "it ends");
}

}  // namespace

int main()
{
  try {
    std::cout.precision(9);
    run();
    return 0;
  } catch (const std::exception & error) {
    std::cerr << error.what() << std::endl;
    return 1;
  }
}
