// SPDX-License-Identifier: MIT OR Apache-2.0

#ifndef FOOTFALL_HARDWARE__LINES_HPP_
#define FOOTFALL_HARDWARE__LINES_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace footfall_hardware
{

/// An open file, closed at its end.
class File
{
public:
  explicit File(int descriptor = -1)
  : descriptor_(descriptor) {}
  ~File() {reset();}
  File(const File &) = delete;
  File & operator=(const File &) = delete;
  File(File && other) noexcept;
  File & operator=(File && other) noexcept;

  bool is_open() const {return descriptor_ >= 0;}
  int descriptor() const {return descriptor_;}
  void reset(int descriptor = -1);

private:
  int descriptor_;
};

/// What a read without waiting has found.
enum class Received
{
  DATA,
  NOTHING,
  LOST,
};

/// A frame of a CAN bus.
struct CanFrame
{
  uint32_t id;
  uint8_t data[8];
  size_t length;
};

/// An interface of SocketCAN that passes the frames of some nodes.
class CanBus
{
public:
  /// Opens the interface. Returns an empty text, or the reason why it is not open.
  std::string open(const std::string & interface, const std::vector<uint8_t> & nodes);
  bool is_open() const {return file_.is_open();}
  void close() {file_.reset();}

  /// Takes the next frame, without waiting.
  Received next(CanFrame & frame);

private:
  File file_;
};

/// A serial port, 8N1.
class SerialPort
{
public:
  /// Opens the port; `baud` is one of the rates that Linux has a name for. Returns an empty text, or the reason why it is
  /// not open.
  std::string open(const std::string & path, unsigned baud);
  bool is_open() const {return file_.is_open();}
  void close() {file_.reset();}

  /// Takes the bytes that have come, without waiting.
  Received next(std::vector<uint8_t> & bytes);

private:
  File file_;
};

}  // namespace footfall_hardware

#endif  // FOOTFALL_HARDWARE__LINES_HPP_
