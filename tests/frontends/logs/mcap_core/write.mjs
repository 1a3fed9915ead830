// node write.mjs OUT.mcap chunked|plain|bare: writes an MCAP file with @mcap/core, for mcap_core_test.cpp.
// 400 sensor_msgs/msg/Imu of 200 Hz on /imu, and 20 messages of another type on /other; chunks of 4 kB, or no chunks
// ("plain"), or chunks without any index or summary ("bare").
import { McapWriter } from '@mcap/core';
import { appendFileSync, writeFileSync } from 'node:fs';

const [out, kind] = process.argv.slice(2);

function imu(index) {
  const view = new DataView(new ArrayBuffer(4 + 8 + 8 + 37 * 8));
  view.setUint8(1, 1); // little-endian CDR
  view.setInt32(4, 1700000000, true);
  view.setUint32(8, index * 5000000, true);
  view.setUint32(12, 4, true);
  view.setUint8(16, 105); // "imu" and its zero end at byte 20: eight bytes after the first four, as doubles need it
  view.setUint8(17, 109);
  view.setUint8(18, 117);
  for (let i = 0; i < 37; ++i) view.setFloat64(20 + i * 8, index + i / 64, true);
  return new Uint8Array(view.buffer);
}

writeFileSync(out, '');
let position = 0n;
const writable = {
  async write(buffer) {
    appendFileSync(out, buffer);
    position += BigInt(buffer.byteLength);
  },
  position: () => position,
};
const bare = kind === 'bare';
const options = { writable, chunkSize: 4096, useChunks: kind !== 'plain' };
if (bare) {
  for (const name of ['MessageIndex', 'ChunkIndex', 'Statistics', 'SummaryOffsets']) options['use' + name] = false;
  options.repeatSchemas = options.repeatChannels = false;
}
const writer = new McapWriter(options);
await writer.start({ profile: 'ros2', library: '' });
const schema = (name) => ({ name, encoding: 'ros2msg', data: new TextEncoder().encode('# left out') });
const schemaId = await writer.registerSchema(schema('sensor_msgs/msg/Imu'));
const otherId = await writer.registerSchema(schema('std_msgs/msg/Empty'));
const channel = (id, topic) => ({ schemaId: id, topic, messageEncoding: 'cdr', metadata: new Map([['a', 'b']]) });
const imuChannel = await writer.registerChannel(channel(schemaId, '/imu'));
const otherChannel = await writer.registerChannel(channel(otherId, '/other'));
for (let index = 0; index < 400; ++index) {
  // Every fourth pair is recorded the wrong way round.
  const shown = index % 8 === 0 ? index + 1 : index % 8 === 1 ? index - 1 : index;
  const logTime = 1700000000000000000n + BigInt(shown) * 5000000n;
  await writer.addMessage({ channelId: imuChannel, sequence: index, logTime, publishTime: logTime, data: imu(shown) });
  if (index % 20 === 0) {
    await writer.addMessage({
      channelId: otherChannel,
      sequence: 0,
      logTime,
      publishTime: logTime,
      data: new Uint8Array(5),
    });
  }
}
await writer.addAttachment({
  name: 'note',
  logTime: 1n,
  createTime: 1n,
  mediaType: 'text/plain',
  data: new Uint8Array(100),
});
await writer.end();
