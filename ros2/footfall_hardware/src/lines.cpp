// SPDX-License-Identifier: MIT OR Apache-2.0

#include "footfall_hardware/lines.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <utility>

namespace footfall_hardware
{
namespace
{

std::string failed(const std::string & what)
{
  return what + ": " + std::strerror(errno);
}

/// What a failed read means.
Received received_nothing()
{
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ? Received::NOTHING : Received::LOST;
}

struct Rate
{
  unsigned baud;
  speed_t constant;
};

constexpr Rate RATES[] = {
  {9600, B9600}, {19200, B19200}, {38400, B38400}, {57600, B57600}, {115200, B115200},
  {230400, B230400}, {460800, B460800}, {500000, B500000}, {921600, B921600},
  {1000000, B1000000}, {2000000, B2000000},
};

}  // namespace

File::File(File && other) noexcept
: descriptor_(std::exchange(other.descriptor_, -1))
{
}

File & File::operator=(File && other) noexcept
{
  reset(std::exchange(other.descriptor_, -1));
  return *this;
}

void File::reset(int descriptor)
{
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
  descriptor_ = descriptor;
}

std::string CanBus::open(const std::string & interface, const std::vector<uint8_t> & nodes)
{
  file_.reset();
  File file(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!file.is_open()) {
    return failed("SocketCAN");
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) {
    return failed(interface);
  }
  std::vector<can_filter> filters;
  for (const uint8_t node : nodes) {
    filters.push_back({node, 0x7F | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  const auto size = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  if (::setsockopt(file.descriptor(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size) != 0 ||
    ::bind(file.descriptor(), reinterpret_cast<sockaddr *>(&address), sizeof(address)) != 0)
  {
    return failed(interface);
  }
  file_ = std::move(file);
  return "";
}

Received CanBus::next(CanFrame & frame)
{
  can_frame read{};
  const ssize_t count = ::read(file_.descriptor(), &read, sizeof(read));
  if (count < 0) {
    // The socket is kept, because it works again once the interface is up again.
    return errno == ENETDOWN ? Received::NOTHING : received_nothing();
  }
  if (count != sizeof(read)) {
    return Received::LOST;
  }
  frame.id = read.can_id;
  frame.length = std::min<size_t>(read.can_dlc, sizeof(frame.data));
  std::copy_n(read.data, frame.length, frame.data);
  return Received::DATA;
}

std::string SerialPort::open(const std::string & path, unsigned baud)
{
  file_.reset();
  const auto rate = std::find_if(
    std::begin(RATES), std::end(RATES), [baud](const Rate & one) {return one.baud == baud;});
  if (rate == std::end(RATES)) {
    return path + ": " + std::to_string(baud) + " Bd is not a rate of Linux";
  }
  // Without O_NONBLOCK the call would wait for a carrier.
  File file(::open(path.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!file.is_open()) {
    return failed(path);
  }
  termios settings{};
  if (::tcgetattr(file.descriptor(), &settings) != 0) {
    return failed(path);
  }
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  // While no byte is available, a read fails with EAGAIN, so a read of 0 bytes means that the port is gone.
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::cfsetspeed(&settings, rate->constant) != 0 ||
    ::tcsetattr(file.descriptor(), TCSANOW, &settings) != 0)
  {
    return failed(path);
  }
  file_ = std::move(file);
  return "";
}

Received SerialPort::next(std::vector<uint8_t> & bytes)
{
  bytes.resize(4096);
  const ssize_t count = ::read(file_.descriptor(), bytes.data(), bytes.size());
  if (count > 0) {
    bytes.resize(static_cast<size_t>(count));
    return Received::DATA;
  }
  bytes.clear();
  return count == 0 ? Received::LOST : received_nothing();
}

}  // namespace footfall_hardware
