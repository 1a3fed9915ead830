#include "frontends/maps/raster_file.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/file_bytes.h"

namespace lodestone {
namespace {

constexpr float unread = std::numeric_limits<float>::quiet_NaN();

bool is_float_page(TIFF* file) {
  std::uint16_t bits = 1;
  std::uint16_t samples = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &format);
  return bits == 32 && samples == 1 && format == SAMPLEFORMAT_IEEEFP;
}

/// Upper limit of the unpacked bytes per packed byte. Data that unpack to less than a tile are unreadable, so that no
/// readable file is refused.
std::uint64_t unpacking_limit(TIFF* file) {
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
  switch (compression) {
    case COMPRESSION_NONE:
      return 1;
    case COMPRESSION_PACKBITS:
      return 64;  // two bytes for 128 repetitions
    case COMPRESSION_ADOBE_DEFLATE:
    case COMPRESSION_DEFLATE:
      return 1100;  // 258 bytes in two bits
    case COMPRESSION_LZW:
      return 2600;  // nearly 4096 bytes in 12 bits
    default:
      return 1U << 16U;  // Zstandard: 128 KiB in four bytes, and less for the others
  }
}

/// Limit of a tile's memory, unless all its bytes are in the file.
constexpr std::uint64_t most_block_bytes = 1U << 30U;

/// The offset and the size of a tile have at least two bytes each in the file.
constexpr std::uint64_t least_bytes_of_a_block = 4;

/// Division of a page into tiles or strips.
struct BlockCut {
  bool tiled = false;
  std::uint64_t blocks = 0;
  std::uint64_t bytes = 0;       ///< of a tile, unpacked
  std::uint64_t last_bytes = 0;  ///< of the last tile: a page may end within a strip
};

/// Positions of a page's tiles in the file.
struct BlockPlaces {
  std::uint64_t end = 0;                 ///< end of the last tile, bytes; detects cut-off files before a run
  std::optional<std::uint64_t> too_few;  ///< bytes of a tile that are too few for a complete tile
};

/// Nothing if the file has no such entries.
std::optional<BlockPlaces> block_offsets(TIFF* file, const BlockCut& cut) {
  std::uint64_t* offsets = nullptr;
  std::uint64_t* counts = nullptr;
  if (cut.blocks != (cut.tiled ? TIFFNumberOfTiles(file) : TIFFNumberOfStrips(file)) ||
      TIFFGetField(file, cut.tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS, &offsets) != 1 ||
      TIFFGetField(file, cut.tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS, &counts) != 1 ||
      offsets == nullptr || counts == nullptr) {
    return std::nullopt;
  }
  const std::uint64_t factor = unpacking_limit(file);
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  BlockPlaces places;
  for (std::uint64_t i = 0; i < cut.blocks; ++i) {
    // A sum that overflows counts as the largest value.
    const std::uint64_t end = offsets[i] + counts[i];
    places.end = std::max(places.end, end < offsets[i] ? most : end);
    const std::uint64_t needed = (i + 1 < cut.blocks ? cut.bytes : cut.last_bytes) / factor;
    if (counts[i] > 0 && counts[i] < needed && !places.too_few) places.too_few = counts[i];
  }
  return places;
}

constexpr const char* kCopyAgain = "copy the complete file, or write it again";

/// Limit for a side of a page or tile.
constexpr std::uint32_t most_pixels = 1U << 28U;

[[noreturn]] void fail_unreadable(const std::string& path) {
  throw InputError(path + ": is not a readable TIFF; write it again");
}

[[noreturn]] void fail_to_read_page(const std::string& path, int page) {
  throw InputError(fmt::format("{}: page {} cannot be read; write the file again", path, page + 1));
}

/// Offset of the first page's description according to the file's first bytes; nothing if they are not of a TIFF.
std::optional<std::uint64_t> announced_description(const FileBytes& file) {
  std::vector<std::uint8_t> head;
  if (file.size() < 16) return std::nullopt;
  file.read(0, 16, head);
  if (head[0] != 'I' || head[1] != 'I') return std::nullopt;  // little-endian, like nearly all files
  if (head[2] == 42) return little_endian<std::uint32_t>(head.data() + 4);
  if (head[2] == 43) return little_endian<std::uint64_t>(head.data() + 8);
  return std::nullopt;
}

[[noreturn]] void fail_to_open(const std::string& path) {
  const FileBytes file(path);
  const auto announced = announced_description(file);
  if (announced && *announced >= file.size()) {
    throw InputError(
        fmt::format("{}: is cut off: the header announces a page at byte {}, but the file has {} bytes; {}", path,
                    *announced, file.size(), kCopyAgain));
  }
  throw InputError(path + ": is not a readable TIFF; write it again" + looks_like(path));
}

}  // namespace

RasterFile::RasterFile(std::string path, std::size_t cache_bytes) : path_(std::move(path)), cache_bytes_(cache_bytes) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path_, code)) throw missing_file(path_);
  TiffHandle first = open_tiff(path_, "r");
  if (!first) fail_to_open(path_);
  const int pages = static_cast<int>(TIFFNumberOfDirectories(first.get()));
  if (TIFFSetDirectory(first.get(), static_cast<tdir_t>(pages - 1)) == 1 && TIFFLastDirectory(first.get()) == 0) {
    throw InputError(
        fmt::format("{}: is cut off or damaged: it announces more pages than the {} readable ones, and the file has {} "
                    "bytes; {}",
                    path_, pages, std::filesystem::file_size(path_), kCopyAgain));
  }
  const std::uint64_t size = std::filesystem::file_size(path_);
  for (int page = 0; page < pages; ++page) {
    // In order: libtiff reaches a page by number only by walking from the first page.
    if ((page == 0 ? TIFFSetDirectory(first.get(), 0) : TIFFReadDirectory(first.get())) != 1) fail_unreadable(path_);
    describe(page, first.get(), size);
  }
  handles_[0].file = std::move(first);
  for (std::size_t i = 1; i < std::min(handles_.size(), pages_.size()); ++i) {
    handles_[i].file = open_tiff(path_, "r");
    if (!handles_[i].file) fail_unreadable(path_);
  }
}

void RasterFile::describe(int page, tiff* file, std::uint64_t size) {
  if (!is_float_page(file)) {
    throw InputError(
        fmt::format("{}: page {} is not float32 with one channel; save it as 32-bit grey", path_, page + 1));
  }
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &columns);
  TIFFGetField(file, TIFFTAG_IMAGELENGTH, &rows);
  if (columns < 1 || rows < 1 || columns > most_pixels || rows > most_pixels) {
    throw InputError(fmt::format("{}: page {} has {} x {} pixels; expected 1 to {} per side", path_, page + 1, columns,
                                 rows, most_pixels));
  }
  if (page == 0) {
    size_ = {static_cast<int>(columns), static_cast<int>(rows)};
  } else if (size_ != cv::Size(static_cast<int>(columns), static_cast<int>(rows))) {
    throw InputError(
        fmt::format("{}: page {} has {} x {} pixels, page 1 has {} x {}; all pages must have the same size", path_,
                    page + 1, columns, rows, size_.width, size_.height));
  }
  pages_.push_back(describe_blocks(page, file, size));
}

/// Sizes are not trusted: a few bytes may announce more or larger tiles than fit in memory.
RasterFile::Page RasterFile::describe_blocks(int page, tiff* file, std::uint64_t size) {
  auto block_columns = static_cast<std::uint32_t>(size_.width);
  auto block_rows = static_cast<std::uint32_t>(size_.height);
  const bool tiled = TIFFIsTiled(file) != 0;
  if (tiled) {
    TIFFGetField(file, TIFFTAG_TILEWIDTH, &block_columns);
    TIFFGetField(file, TIFFTAG_TILELENGTH, &block_rows);
  } else {
    TIFFGetFieldDefaulted(file, TIFFTAG_ROWSPERSTRIP, &block_rows);
    block_rows = std::min(block_rows, static_cast<std::uint32_t>(size_.height));
  }
  if (block_columns < 1 || block_rows < 1 || block_columns > most_pixels || block_rows > most_pixels)
    fail_unreadable(path_);
  const auto along = [](int pixels, std::uint32_t block) {
    return (static_cast<std::uint64_t>(pixels) + block - 1) / block;
  };
  const std::uint64_t blocks = along(size_.width, block_columns) * along(size_.height, block_rows);
  blocks_ += blocks;
  if (blocks_ > size / least_bytes_of_a_block) {
    throw InputError(fmt::format("{}: is damaged: pages 1 to {} announce {} tiles, but the file has {} bytes; {}",
                                 path_, page + 1, blocks_, size, kCopyAgain));
  }
  const std::uint64_t bytes = sizeof(float) * block_columns * block_rows;
  const std::uint32_t last_rows = static_cast<std::uint32_t>(size_.height) -
                                  (static_cast<std::uint32_t>(size_.height) - 1) / block_rows * block_rows;
  const auto places =
      block_offsets(file, {tiled, blocks, bytes, tiled ? bytes : sizeof(float) * block_columns * last_rows});
  if (!places)
    throw InputError(fmt::format("{}: page {} has no offsets of its pixels; {}", path_, page + 1, kCopyAgain));
  if (places->end > size) {
    throw InputError(
        fmt::format("{}: is cut off: page {} announces pixels up to byte {}, but the file has {} bytes; {}", path_,
                    page + 1, places->end, size, kCopyAgain));
  }
  if (places->too_few) {
    throw InputError(fmt::format(
        "{}: is damaged: page {} announces tiles of {} x {} pixels ({} bytes), one of which has only {} bytes; {}",
        path_, page + 1, block_columns, block_rows, bytes, *places->too_few, kCopyAgain));
  }
  if (unpacking_limit(file) > 1 && bytes > most_block_bytes) {
    throw InputError(
        fmt::format("{}: page {} has tiles of {} x {} pixels, which require {} bytes each; expected up to {}; save the "
                    "file in smaller "
                    "tiles",
                    path_, page + 1, block_columns, block_rows, bytes, most_block_bytes));
  }
  return {TIFFCurrentDirOffset(file), {static_cast<int>(block_columns), static_cast<int>(block_rows)}, tiled};
}

tiff* RasterFile::file_at(int page) const {
  Handle& handle = handles_[static_cast<std::size_t>(page) % handles_.size()];
  if (handle.page != page) {
    handle.page = -1;
    if (TIFFSetSubDirectory(handle.file.get(), pages_[page].offset) != 1) fail_to_read_page(path_, page);
    handle.page = page;
  }
  return handle.file.get();
}

/// Empty if the file does not contain the tile.
cv::Mat1f RasterFile::block(int page, std::uint32_t index) const {
  const BlockKey key(page, index);
  if (const auto found = cached_.find(key); found != cached_.end()) {
    cache_.splice(cache_.begin(), cache_, found->second);
    return found->second->second;
  }
  const Page& shape = pages_[page];
  TIFF* file = file_at(page);
  // GDAL omits tiles without data: their size is 0.
  if (TIFFGetStrileByteCount(file, index) == 0) return {};
  // A page may end within its last strip.
  const std::int64_t there = shape.tiled ? shape.block.height : size_.height - std::int64_t{index} * shape.block.height;
  cv::Mat1f values(static_cast<int>(std::min<std::int64_t>(shape.block.height, there)), shape.block.width, unread);
  const auto bytes = static_cast<tmsize_t>(values.total() * sizeof(float));
  const tmsize_t read = shape.tiled ? TIFFReadEncodedTile(file, index, values.data, bytes)
                                    : TIFFReadEncodedStrip(file, index, values.data, bytes);
  if (read < 0) fail_to_read_page(path_, page);
  cache_.emplace_front(key, values);
  cached_[key] = cache_.begin();
  cached_bytes_ += static_cast<std::size_t>(bytes);
  while (cached_bytes_ > cache_bytes_ && cache_.size() > 1) {
    cached_bytes_ -= cache_.back().second.total() * sizeof(float);
    cached_.erase(cache_.back().first);
    cache_.pop_back();
  }
  return values;
}

cv::Mat1f RasterFile::read(int page, const cv::Rect& window) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const cv::Size size = pages_[page].block;
  const int across = (size_.width + size.width - 1) / size.width;
  const cv::Rect wanted(window.x, size_.height - window.br().y, window.width,
                        window.height);  // row order of the file, from above
  cv::Mat1f values(wanted.size(), unread);
  for (int row = wanted.y / size.height; row * size.height < wanted.br().y; ++row) {
    for (int column = wanted.x / size.width; column * size.width < wanted.br().x; ++column) {
      const cv::Mat1f pixels =
          block(page, static_cast<std::uint32_t>(row) * across + static_cast<std::uint32_t>(column));
      if (pixels.empty()) continue;
      const cv::Point corner(column * size.width, row * size.height);
      const cv::Rect part = wanted & cv::Rect(corner, pixels.size());
      pixels(part - corner).copyTo(values(part - wanted.tl()));
    }
  }
  cv::flip(values, values, 0);
  return values;
}

}  // namespace lodestone
