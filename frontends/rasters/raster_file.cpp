#include "frontends/rasters/raster_file.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/readers/logs/file_bytes.h"

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

/// Where the page's last tile ends, in bytes; nothing where the file does not say. What is cut off is better said before a
/// run than in its middle.
std::optional<std::uint64_t> end_of_page(TIFF* file) {
  std::uint64_t* offsets = nullptr;
  std::uint64_t* counts = nullptr;
  const bool tiled = TIFFIsTiled(file) != 0;
  if (TIFFGetField(file, tiled ? TIFFTAG_TILEOFFSETS : TIFFTAG_STRIPOFFSETS, &offsets) != 1 ||
      TIFFGetField(file, tiled ? TIFFTAG_TILEBYTECOUNTS : TIFFTAG_STRIPBYTECOUNTS, &counts) != 1) {
    return std::nullopt;
  }
  std::uint64_t end = 0;
  const std::uint32_t blocks = tiled ? TIFFNumberOfTiles(file) : TIFFNumberOfStrips(file);
  for (std::uint32_t i = 0; i < blocks; ++i) {
    // A sum that wraps round is as far away as can be.
    const std::uint64_t tile_end = offsets[i] + counts[i];
    end = std::max(end, tile_end < offsets[i] ? std::numeric_limits<std::uint64_t>::max() : tile_end);
  }
  return end;
}

constexpr const char* kCopyAgain = "copy it whole, or write it again";

/// Where the first page's description begins, as the file's first bytes say; nothing where they are no TIFF's.
std::optional<std::uint64_t> announced_description(const FileBytes& file) {
  std::vector<std::uint8_t> head;
  if (file.size() < 16) return std::nullopt;
  file.read(0, 16, head);
  if (head[0] != 'I' || head[1] != 'I') return std::nullopt;  // what we write, and nearly everyone
  if (head[2] == 42) return little_endian<std::uint32_t>(head.data() + 4);
  if (head[2] == 43) return little_endian<std::uint64_t>(head.data() + 8);
  return std::nullopt;
}

[[noreturn]] void fail_to_open(const std::string& path) {
  const FileBytes file(path);
  const auto announced = announced_description(file);
  if (announced && *announced >= file.size()) {
    throw InputError(fmt::format("{}: is cut off: its header announces a page at byte {}, the file has {} bytes; {}", path,
                                 *announced, file.size(), kCopyAgain));
  }
  throw InputError(path + ": is no readable TIFF; write it again" + looks_like(path));
}

}  // namespace

RasterFile::RasterFile(std::string path, std::size_t cache_bytes) : path_(std::move(path)), cache_bytes_(cache_bytes) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path_, code)) throw InputError(path_ + ": there is no such file");
  TiffHandle first = open_tiff(path_, "r");
  if (!first) fail_to_open(path_);
  const int pages = static_cast<int>(TIFFNumberOfDirectories(first.get()));
  if (TIFFSetDirectory(first.get(), static_cast<tdir_t>(pages - 1)) == 1 && TIFFLastDirectory(first.get()) == 0) {
    throw InputError(fmt::format("{}: is cut off or damaged: it announces more than the {} pages that can be read, the file has {} "
                                 "bytes; {}", path_, pages, std::filesystem::file_size(path_), kCopyAgain));
  }
  for (int page = 0; page < pages; ++page) open(page);
}

void RasterFile::open(int page) {
  TiffHandle file = open_tiff(path_, "r");
  std::error_code code;
  const std::uintmax_t size = std::filesystem::file_size(path_, code);
  if (!file || code || TIFFSetDirectory(file.get(), static_cast<tdir_t>(page)) != 1) {
    throw InputError(path_ + ": is no readable TIFF; write it again");
  }
  if (!is_float_page(file.get())) {
    throw InputError(fmt::format("{}: page {} is not float32 with one channel; save it as 32-bit grey", path_, page + 1));
  }
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &columns);
  TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &rows);
  constexpr std::uint32_t most = 1U << 28U;
  if (columns < 1 || rows < 1 || columns > most || rows > most) {
    throw InputError(fmt::format("{}: page {} has {} x {} pixels; expected 1 to {} a side", path_, page + 1, columns, rows, most));
  }
  if (page == 0) {
    columns_ = static_cast<int>(columns);
    rows_ = static_cast<int>(rows);
  } else if (static_cast<int>(columns) != columns_ || static_cast<int>(rows) != rows_) {
    throw InputError(fmt::format("{}: page {} has {} x {} pixels, page 1 has {} x {}; all must be of one size", path_, page + 1,
                                 columns, rows, columns_, rows_));
  }
  const auto end = end_of_page(file.get());
  if (!end) throw InputError(fmt::format("{}: page {} does not say where its pixels are; {}", path_, page + 1, kCopyAgain));
  if (*end > size) {
    throw InputError(fmt::format("{}: is cut off: page {} announces pixels up to byte {}, the file has {} bytes; {}", path_, page + 1,
                                 *end, size, kCopyAgain));
  }
  std::uint32_t block_columns = columns;
  std::uint32_t block_rows = rows;
  const bool tiled = TIFFIsTiled(file.get()) != 0;
  if (tiled) {
    TIFFGetField(file.get(), TIFFTAG_TILEWIDTH, &block_columns);
    TIFFGetField(file.get(), TIFFTAG_TILELENGTH, &block_rows);
  } else {
    TIFFGetFieldDefaulted(file.get(), TIFFTAG_ROWSPERSTRIP, &block_rows);
    block_rows = std::min(block_rows, rows);
  }
  if (block_columns < 1 || block_rows < 1 || block_columns > most || block_rows > most) {
    throw InputError(path_ + ": is no readable TIFF; write it again");
  }
  blocks_.push_back({static_cast<int>(block_columns), static_cast<int>(block_rows), tiled});
  files_.push_back(std::move(file));
}

RasterFile::Block RasterFile::block(int page, std::uint32_t index) const {
  const BlockKey key(page, index);
  if (const auto found = cached_.find(key); found != cached_.end()) {
    cache_.splice(cache_.begin(), cache_, found->second);
    return found->second->second;
  }
  const Blocks& shape = blocks_[page];
  const auto values = std::make_shared<std::vector<float>>(static_cast<std::size_t>(shape.columns) * shape.rows, unread);
  const auto bytes = static_cast<tmsize_t>(values->size() * sizeof(float));
  TIFF* file = files_[page].get();
  // GDAL leaves tiles without data out altogether: their size is 0.
  if (TIFFGetStrileByteCount(file, index) > 0) {
    const tmsize_t read = shape.tiled ? TIFFReadEncodedTile(file, index, values->data(), bytes)
                                      : TIFFReadEncodedStrip(file, index, values->data(), bytes);
    if (read < 0) throw InputError(fmt::format("{}: page {} cannot be read; write the file again", path_, page + 1));
  }
  cache_.emplace_front(key, values);
  cached_[key] = cache_.begin();
  cached_bytes_ += static_cast<std::size_t>(bytes);
  while (cached_bytes_ > cache_bytes_ && cache_.size() > 1) {
    cached_bytes_ -= cache_.back().second->size() * sizeof(float);
    cached_.erase(cache_.back().first);
    cache_.pop_back();
  }
  return values;
}

void RasterFile::read(int page, const RasterWindow& window, float* values) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Blocks& shape = blocks_[page];
  const std::uint32_t blocks_across = static_cast<std::uint32_t>((columns_ + shape.columns - 1) / shape.columns);
  const int top = rows_ - window.row - window.rows;  // in the file's order, from above
  for (int block_row = top / shape.rows; block_row * shape.rows < top + window.rows; ++block_row) {
    for (int block_column = window.column / shape.columns; block_column * shape.columns < window.column + window.columns;
         ++block_column) {
      const Block pixels = block(page, static_cast<std::uint32_t>(block_row) * blocks_across +
                                           static_cast<std::uint32_t>(block_column));
      const int left = std::max(window.column, block_column * shape.columns);
      const int right = std::min(window.column + window.columns, (block_column + 1) * shape.columns);
      const int first = std::max(top, block_row * shape.rows);
      const int last = std::min(top + window.rows, (block_row + 1) * shape.rows);
      for (int row = first; row < last; ++row) {
        const float* from = pixels->data() + static_cast<std::size_t>(row - block_row * shape.rows) * shape.columns +
                            (left - block_column * shape.columns);
        std::copy_n(from, right - left,
                    values + static_cast<std::size_t>(top + window.rows - 1 - row) * window.columns + (left - window.column));
      }
    }
  }
}

}  // namespace lodestone
