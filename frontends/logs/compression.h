#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace lodestone {

enum class Codec {
  none,
  lz4,  ///< LZ4 frames
  zstd,
  bz2
};

/// Packed bytes are damaged. The caller adds the file's name.
class CompressionError : public std::runtime_error {
 public:
  explicit CompressionError(const std::string& message) : std::runtime_error(message) {}
};

/// Meaning of `size` for the unpacked bytes.
enum class UnpackedSize {
  exact,    ///< exactly `size` bytes
  at_most,  ///< at most `size` bytes
  cut_off   ///< at most `size` bytes; the packed bytes may end early
};

/// Unpacks into `out`. Memory grows with the actual content, not with announced sizes. Throws CompressionError if the
/// bytes are damaged or contradict `size`.
void unpack(Codec codec, std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
            std::vector<std::uint8_t>& out);

/// Packs into one frame or stream.
std::vector<std::uint8_t> pack(Codec codec, std::span<const std::uint8_t> bytes);

bool starts_like_zstd(std::span<const std::uint8_t> bytes);

constexpr std::size_t largest_message = std::size_t{1} << 29;  ///< bytes

/// A message in CDR, possibly packed by a ROS 2 recorder (compression_mode: MESSAGE). CDR begins with a zero byte, so
/// that a zstd frame is recognizable. Returns a view of the bytes or of `unpacked`. Throws CompressionError.
std::span<const std::uint8_t> unpacked_cdr(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& unpacked);

/// Unpacks a file of zstd frames piece by piece; writes at most `room` bytes. Before writing, `check` gets the first
/// unpacked bytes (at least 16, if there are so many) and may throw to refuse the file. Throws InputError with the
/// file's name.
void unpack_zstd_file(const std::string& path, const std::string& out, std::uint64_t room,
                      const std::function<void(std::span<const std::uint8_t>)>& check);

}  // namespace lodestone
