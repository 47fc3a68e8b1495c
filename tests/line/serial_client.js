// A Modbus TCP client on modbus-serial, for tests: writes a word, reads three, prints them.
const Client = require("modbus-serial");

async function main(port, device, address, word) {
  const client = new Client();
  await client.connectTCP("127.0.0.1", { port });
  client.setID(device);
  client.setTimeout(5000);
  await client.writeRegister(address, word);
  const written = await client.readHoldingRegisters(address, 1);
  const status = await client.readHoldingRegisters(3201, 2);
  client.close(() => {});
  console.log(JSON.stringify([...written.data, ...status.data]));
}

main(...process.argv.slice(2).map(Number)).catch((fault) => {
  console.error(String(fault.message || fault));
  process.exit(1);
});
