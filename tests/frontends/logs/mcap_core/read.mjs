// node read.mjs IN.mcap: reads an MCAP file without compression by its indexes with @mcap/core, for mcap_core_test.cpp.
// Prints the profile, then for each topic: name, type, encoding of the definition, messages, first time, first message
// in hex.
import { McapIndexedReader } from '@mcap/core';
import { readFileSync } from 'node:fs';

const bytes = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.byteLength),
  read: async (offset, size) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(size)),
};
const reader = await McapIndexedReader.Initialize({ readable });
console.log(reader.header.profile);
const topics = new Map();
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const topic = topics.get(channel.topic) ?? {
    type: `${schema.name} ${schema.encoding}`,
    messages: 0,
    first: `${message.logTime} ${Buffer.from(message.data).toString('hex')}`,
  };
  ++topic.messages;
  topics.set(channel.topic, topic);
}
for (const name of [...topics.keys()].sort()) {
  const topic = topics.get(name);
  console.log(`${name} ${topic.type} ${topic.messages} ${topic.first}`);
}
