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

/// Packed bytes are damaged; whoever knows the file adds where.
class CompressionError : public std::runtime_error {
 public:
  explicit CompressionError(const std::string& message) : std::runtime_error(message) {}
};

/// What `size` says of the unpacked bytes.
enum class UnpackedSize {
  exact,    ///< so many
  at_most,  ///< no more
  cut_off   ///< no more, and the packed bytes may end early: what they hold is given
};

/// Unpacks into `out`. Memory grows with what comes, never by what is announced alone. Throws CompressionError where
/// the bytes are damaged or contradict `size`.
void unpack(Codec codec, std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
            std::vector<std::uint8_t>& out);

/// In one frame, or one stream.
std::vector<std::uint8_t> pack(Codec codec, std::span<const std::uint8_t> bytes);

bool starts_like_zstd(std::span<const std::uint8_t> bytes);

constexpr std::size_t largest_message = std::size_t{1} << 29;  ///< bytes

/// A message in CDR, which a recorder of ROS 2 may have packed by itself (compression_mode: MESSAGE): CDR starts with a
/// zero, so that a frame of zstd tells itself. A view of the bytes, or of `unpacked`. Throws CompressionError.
std::span<const std::uint8_t> unpacked_cdr(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& unpacked);

/// Unpacks a file of zstd frames piece by piece; at most `room` bytes are written. Before the first of them, `check`
/// gets what the unpacked bytes begin with: 16 of them or more, where there are so many; it throws what they are
/// refused with. Throws InputError, naming the file.
void unpack_zstd_file(const std::string& path, const std::string& out, std::uint64_t room,
                      const std::function<void(std::span<const std::uint8_t>)>& check);

}  // namespace lodestone
